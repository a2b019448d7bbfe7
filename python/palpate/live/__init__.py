"""The live page: a running measurement, or a recording, in a browser.

`measurement` measures, `file_review` reads a recording; both send events to their parts: `annotations`, `plan`,
`channel_status`, `connection`. `instruction_rules` decides what to do and what is wrong. `protocol` has the messages to a
page, `page_commands` those from it, and `commands` runs them. `page_frames` makes frames of samples, `multiresolution` keeps
them, the older ones thinned, and `client` sends them to a page as fast as it reads. `app` is the web application, `access`
decides who may open it, `server` runs it.
"""
