"""A stream of Lab Streaming Layer as a source: `lsl:NAME`."""
