"""Pages that set one figure of the reports beside another: synthetic beside real, every metric beside its null."""
