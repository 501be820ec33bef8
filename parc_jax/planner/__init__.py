"""Questions are put to a model here: one alone, many at once, or one prepared and asked again."""
