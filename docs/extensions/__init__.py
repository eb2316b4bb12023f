"""What Sphinx learns for these pages."""
