"""The command `engine-dyn`: thin commands around the functions of the package.

main                         the group of commands
running, looking, knowing    commands that compute, that look at archives, that only tell
arguments, files, exits      options, files, exit statuses
"""
