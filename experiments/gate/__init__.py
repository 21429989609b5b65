"""The regression gate: whether the present code, or anybody's method, is worse than a baseline on the same pages."""
