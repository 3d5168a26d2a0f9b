"""`python -m handeye`: the command line."""

from handeye.cli import main

main()
