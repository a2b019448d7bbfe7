"""Print the required results of some themes.

python -m bench.accuracy.must_hold [--seeds 200] [THEME ...]
"""

import argparse

from bench.accuracy.must_hold import THEMES, rows_of, text


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("themes", nargs="*", choices=[[], *THEMES], help="default: all")
    parser.add_argument("--seeds", type=int, default=200, help="recordings of each row")
    options = parser.parse_args()
    print(text(row for theme in options.themes or THEMES for row in rows_of(theme, options.seeds)))


if __name__ == "__main__":
    main()
