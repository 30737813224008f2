"""What is read from solved states; public as `bh.contact`."""
