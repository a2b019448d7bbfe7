"""``python -m palpate``: the command line."""

from palpate.entry import main

main()
