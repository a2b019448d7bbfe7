"""Text tables: encoding, delimiter, header, samples, and what is neither."""
