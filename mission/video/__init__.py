"""Images of the camera for people: MJPEG, RTP, films, single images."""
