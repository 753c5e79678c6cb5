"""What commands show: tables, JSON, pictures and progress."""
