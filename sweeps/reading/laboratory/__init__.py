"""Files as laboratories have them: each format is a few lines around the library that reads it."""
