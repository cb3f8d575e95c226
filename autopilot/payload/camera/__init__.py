"""The camera the vehicle carries: images, video, lens, storage."""
