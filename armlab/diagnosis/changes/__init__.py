"""What changed between two recordings of one robot: wear, payload, temperature."""
