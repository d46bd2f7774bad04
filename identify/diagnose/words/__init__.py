"""A diagnosis in sentences: `diagnosis` of all, `causes`, `drift`, `gap`, and `against` a simulator."""
