"""The paper's experiments as planned, resumable trials: plan, run, store, report."""
