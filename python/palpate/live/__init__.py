"""The live page: a running measurement in a browser, on this machine.

`session` measures and takes commands; `feed` makes frames of samples; `protocol` reads what pages say; `summary` is what
they are told; `hub` sends it, to each page as fast as it can take it; `gatekeeper` decides who may ask; `server` puts
them together.
"""
