"""Follow a page as a browser does, and draw nothing: every document that has changed, and every picture.

    .venv/bin/python tools/watch_page.py http://127.0.0.1:8000/

Ends when the page is gone. A browser that draws in software takes as much of a small machine as a session;
this takes next to nothing, so what a session then loses is what the page costs it.
"""

import http.client
import json
import sys
from urllib.parse import urlsplit


def follow(address: str) -> None:
    """Fetch what the page at an address would fetch, until it is gone."""
    place = urlsplit(address)
    port = place.port or 80
    stream = http.client.HTTPConnection(place.hostname or "", port)
    fetching = http.client.HTTPConnection(place.hostname or "", port)
    stream.request("GET", "/events?page=0123456789abcdef")
    seen: dict[str, int] = {}
    with stream.getresponse() as told:
        for line in told:
            if not line.startswith(b"data: "):
                continue
            for name, version in json.loads(line[6:]).items():
                if version > seen.get(name, 0):
                    fetching.request("GET", f"/document/{name}")
                    found = json.loads(fetching.getresponse().read())
                    seen[name] = found["version"]
                    if name == "picture" and found["data"] and found["data"]["has_image"]:
                        fetching.request("GET", f"/picture/{found['data']['number']}")
                        fetching.getresponse().read()


if __name__ == "__main__":
    try:
        follow(sys.argv[1])
    except OSError:
        pass
    except http.client.HTTPException:
        pass
