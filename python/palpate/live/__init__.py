"""The live page: a running measurement in a browser, on this machine.

`session` measures and runs commands; `feed` makes frames of samples; `protocol` parses the messages from pages;
`summary` is the state that is sent to the pages; `hub` sends it, to each page as fast as the page reads; `gatekeeper`
is the access control; `server` connects these parts.
"""
