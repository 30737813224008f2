"""One folder a chapter of the source, one file a study."""
