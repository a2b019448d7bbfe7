"""Tables of other programs: files and data frames with any two channels."""
