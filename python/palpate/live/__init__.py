"""The live page: a running measurement, or a recording, in a browser.

`measurement` measures, or reads a recording, and sends events to its parts: `events`, `plan`, `signal_state`. `commands`
has the table of commands, and the parts that obey; `state_rules` says what to do and what is wrong. `feed` makes messages
and frames of samples, `levels` keeps them, the older ones thinned, `hub` sends them to each page as fast as it reads.
`app` is the web application, `access` decides who may open it, `server` runs it.
"""
