"""A report that can be mailed: one HTML file with tables, figures and an explorer.

page                      the file, put together
sections                  words and tables, with key_results, failures and model_limits
embedding                 numbers as they lie in the page
key_figures               which figures are shown
drawing.js, explorer.js   draw them, and the explorer, with BokehJS
explore                   the same over a whole archive, in a notebook
"""
