"""Formats that are not text: Excel, XDF, Parquet, Arrow, data frames."""
