"""`python -m twolink.cli` is `twolink`."""

from twolink.cli import main

main()
