"""The report for people: one HTML file, without a request to anywhere, made of the runs' own files."""
