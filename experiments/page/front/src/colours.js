// Error to colour: a few stops of a map that everybody can tell apart, with straight lines between them.

export function colourOf(stops, share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1)
  const before = Math.min(Math.floor(place), stops.length - 2)
  const part = place - before
  return stops[before].map((value, i) => (value + part * (stops[before + 1][i] - value)) / 255)
}
