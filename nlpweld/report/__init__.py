"""Tables and figures from stored records and data alone; no solver has to be installed."""
