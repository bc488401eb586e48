def pages(): return {"keys.md": "# Keys\n"}
