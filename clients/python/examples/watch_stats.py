# SPDX-License-Identifier: MIT
"""Watches a view that somebody else edits, a line for each frame; or the totals of the server.

usage: watch_stats.py [VIEW] [URL]
"""
import sys
import time

import vitrail


def watch_view(client, view):
    for event in client.view(view).events():
        if event.name == "frame":
            timings = event.data["stats"]["timings_ms"]
            kind = "exact" if event.data["exact"] else f"{event.data['scale']:.2f}"
            print(f"revision {event.data['revision']:>5} {kind:>5} {event.data['bytes']:>8} bytes "
                  f"{timings['total']:8.1f} ms", flush=True)
        elif event.name == "problem":
            print(f"problem: {event.data.get('detail')}", flush=True)


def watch_server(client):
    while True:
        stats = client.stats()
        renders = stats["renders"]
        print(f"up {stats['uptime_s']:.0f} s, {stats['scenes']['stored']} scenes, "
              f"{renders['rendered']} rendered, {renders['failed']} failed, "
              f"{renders['waiting']} waiting", flush=True)
        time.sleep(1)


def main(view=None, url=None):
    with vitrail.Client(url) as client:
        try:
            if view:
                watch_view(client, view)
            else:
                watch_server(client)
        except KeyboardInterrupt:
            pass


if __name__ == "__main__":
    if len(sys.argv) > 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
