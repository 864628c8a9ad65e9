"""Fault injection: every system call of a run that writes made to fail once, or killed there.

layer.c     put before libc: counts the calls, fails the n-th or kills the process there
server      a process with all kernels warm, from which each run is forked
power       what a failure of the power would leave of the files of a killed process
scenarios   what is run
campaign    all points: which there are, which are done, what became of each
"""
