"""Files of others: NWB, Plexon, Phy, sorter folders, raw traces; what fails inside a package is one line."""
