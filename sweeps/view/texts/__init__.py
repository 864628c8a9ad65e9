"""Texts for people: what an archive, an engine or the package holds.

archives, interrupted    an archive; an interrupted run
comparison, published    two archives; computed beside published values
engines, lists           an engine; everything there is to choose from
report                   one HTML file with tables, figures and an explorer
"""
