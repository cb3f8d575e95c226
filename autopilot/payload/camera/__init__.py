"""The camera the vehicle carries: pictures, video, lens, storage."""
