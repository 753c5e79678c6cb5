"""What comes to the page from outside: bodies of requests and dropped files, within limits."""
