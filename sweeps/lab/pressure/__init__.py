"""Recorded pressure becomes a diagram, and is judged.

pressure                       the steps from columns to a diagram, in a fixed order
cycles_of_signals, work_loops  signals over time, teeth or volume become cycles over the crank angle
imported_pressure              what comes out; measures of the engine; remarks
evaluation                     what figures of recorded cycles need
reading                        `sweeps.read_pressure`
"""
