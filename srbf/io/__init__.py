"""Reading and writing: images (the only import of OpenImageIO), texture containers, scene.glb, atomic files, half floats."""
