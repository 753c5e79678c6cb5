"""The whole whisker on the page: scans by the rod, computed in a process apart."""
