"""The graph of parameters and quantities, as plain data.

`graph` puts the files together, one for each subject, says what there is, and has the words that
select one of several nodes of a name; `node` says what a node is. Formulas are not here: they stand
in `engine_dyn.geometry`, `pressure`, `loads`, `forces` and `speed`. Kernels are imported where they
are called: importing the graph compiles and loads none.

To add a quantity:

1. Write its formula as a function of numbers and arrays in the room of its subject, with symbol,
   unit and source in the docstring. A product or a quotient of other quantities needs no function.
2. Add a `Node` to `NODES` of the subject's file here. `needs` names the parameters, quantities and
   constants that it is made from, and `make` takes them by these names, in SI units; `formula` in
   `node` gives both for a function that takes them in their order. `unit` is that of files, as
   UDUNITS reads it; `si` converts it. The planner works out the axes, and command line, files and
   figures take name, symbol, unit and long name from the node.
3. Write the quantity's line into README.md with `python tools/reference_tables.py`, and test the
   formula.

Where the formula depends on what a scene is (offset or centred mechanism, equal or unequal
cylinders, kind of load), add one node for each case, with `when`, or several with `variants`. A new
kind of case is a new group of `ALTERNATIVES` in `graph` and one line in the scene's `words`.

A new key of scenes is a `parameter` in `PARAMETERS` of `parameters` or of its subject's file. A
parameter with `make` is derived from others unless it is given; `unless_given` is its value where
nothing gives one.

A result of the speed solution is not a node of its own: it is a row of the table in
`engine_dyn.speed`, from which `speed` makes the nodes.
"""
