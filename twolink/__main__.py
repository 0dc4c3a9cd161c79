"""`python -m twolink` is `twolink`."""

from twolink.cli import main

main()
