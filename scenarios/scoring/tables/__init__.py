"""Tables: a method a row, for the terminal and the page."""
