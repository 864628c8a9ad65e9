"""Looking into archives: opening, searching, comparing, exporting."""
