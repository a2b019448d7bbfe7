"""What is written in a cell: a number, a time, a unit, no value."""
