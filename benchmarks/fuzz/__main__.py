"""`python -m benchmarks.fuzz`: see `campaign`, which other processes import too."""

from benchmarks.fuzz.campaign import main

main()
