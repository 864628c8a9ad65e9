"""`python -m benchmarks.fuzz`: see `benchmarks.fuzz.campaign`."""

from benchmarks.fuzz.campaign import main

if __name__ == "__main__":
    main()
