"""Parts of an image."""
