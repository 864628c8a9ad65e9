"""From a recording of cylinder pressure to a diagram of the cycle.

measures, encoder_angles, cycles_of_signals  signals over time or teeth become cycles over angle
pressure, imported_pressure  the steps from a recording to a diagram, and what comes out
pressure_remarks, work_loops what is remarkable in it
evaluation                   recorded cycles as a Dataset, for figures
reading                      the public `sweeps.read_pressure`
"""
