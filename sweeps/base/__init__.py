"""The ground of all other rooms: errors, checks, labels of axes, files of every format."""
