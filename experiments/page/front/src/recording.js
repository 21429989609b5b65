// The recorded sheet as arrays: states of the flattening, where the vertices lie in the pictures, and their error.

function unpacked(base64) {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))
  return new Uint16Array(bytes.buffer)
}

export function readRecording(text) {
  const packed = JSON.parse(text)
  const [rows, columns] = packed.grid
  const size = rows * columns * 3
  const whole = unpacked(packed.positions)
  const positions = new Float32Array(whole.length)
  for (let i = 0; i < whole.length; i += 1) positions[i] = packed.low_mm[i % 3] + whole[i] * packed.step_mm[i % 3]
  const frames = packed.steps.map((_, k) => positions.subarray(k * size, (k + 1) * size))
  const picture = Float32Array.from(unpacked(packed.picture_xy), (value) => value / 65535)
  const error = Float32Array.from(unpacked(packed.error), (value) => value * packed.error_step_mm)
  return { ...packed, rows, columns, frames, picture, error }
}

// The state at `way`, 0 to 1, between the two recorded ones beside it; into `out`, and what they say of themselves.
export function stateAt(recording, way, out) {
  const { frames, steps, times_s: times } = recording
  const place = Math.min(Math.max(way, 0), 1) * (frames.length - 1)
  const before = Math.min(Math.floor(place), frames.length - 2)
  const share = place - before
  const [from, to] = [frames[before], frames[before + 1]]
  let height = 0
  for (let i = 0; i < out.length; i += 1) {
    out[i] = from[i] + share * (to[i] - from[i])
    if (i % 3 === 2 && out[i] > height) height = out[i]
  }
  const between = (values) => values[before] + share * (values[before + 1] - values[before])
  return { step: Math.round(between(steps)), time_s: between(times), height_mm: height }
}
