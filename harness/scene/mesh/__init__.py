"""Meshes: reads them from files, cuts their faces into triangles, cleans and places them. Start with mesh.py."""
