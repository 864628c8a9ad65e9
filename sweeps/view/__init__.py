"""Results as people read them: figures, texts, reports, and `dyn` of a dataset."""
