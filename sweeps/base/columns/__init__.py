"""Tables of laboratories: columns with their units, whatever the format of the file."""
