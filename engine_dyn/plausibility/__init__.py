"""Whether values are those of engines: a wrong unit is seldom seen in a number alone.

`usual_ranges.py` is the table of what engines have; `judgement.py` compares values with it.
"""
