"""How a prompt, a notebook and a figure show an object.

`text` writes the short lines of a prompt, `cards` the HTML of a notebook, `markup` makes elements and drawings, and `plots`
draws with matplotlib. The classes import these modules when they are shown.
"""
