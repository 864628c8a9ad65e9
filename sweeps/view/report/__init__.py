"""A report that can be mailed: one HTML file with tables, figures and an explorer.

page                      the file, put together
sections                  words and tables, with key_results, failures and model_limits
embedding                 numbers as they lie in the page
key_figures               which figures are shown, and which selectors the explorer has
charts                    how figures look, in Bokeh, without numbers
program.js                fills them in a page, as sliders and selectors say
explore                   the same over a whole archive, in a notebook
"""
