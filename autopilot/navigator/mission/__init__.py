"""The flight of uploaded mission items."""
