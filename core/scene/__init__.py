"""What is traced: objects, solids, materials, lights and camera. Data only; no technique knows more than this."""
