"""Is a picture right, and how far off is it: references, masks, truths, certificates, hits."""
