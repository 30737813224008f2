"""The independent shell model that judges `bh`; it shares the description and the driver, never the mechanics."""
