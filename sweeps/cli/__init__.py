"""The command `engine-dyn`: thin commands around the functions of the package."""
