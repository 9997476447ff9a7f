"""What a run leaves: one JSON record a task, whole, sealed by a digest, told by a published schema."""
