"""A report that can be mailed: one HTML file with tables, figures and an explorer."""
