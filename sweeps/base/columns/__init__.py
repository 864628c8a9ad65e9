"""Tables of laboratories: columns with their units, whatever the format of the file.

recording         columns of a file; `read_recording` picks the reader by the format
text_tables       text files; encodings
formats           files that other libraries read
headers, units    names and units of columns, from the lines above the numbers
recorded_columns  columns, and which of them are angle and pressure
options           keys for all of this
"""
