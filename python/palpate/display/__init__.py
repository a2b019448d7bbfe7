"""How a prompt, a notebook and a figure show an object.

`text` writes the short lines of a prompt, `cards` the HTML of a notebook with the `drawings` in it, `markup` escapes, and
`plots` draws with matplotlib. The classes import these modules when they are shown.
"""
