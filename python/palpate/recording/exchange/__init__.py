"""Recordings in other formats: palpate's own as Parquet, Arrow and data frames; files of Analog Devices' program."""
