// The scene: a sheet above the bed, under the light that it was photographed in, or coloured by its error.

import {
  AmbientLight,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  DynamicDrawUsage,
  LineBasicMaterial,
  LineLoop,
  LineSegments,
  LinearMipmapLinearFilter,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  PerspectiveCamera,
  SRGBColorSpace,
  Scene,
  Texture,
  Vector3,
  WebGLRenderer,
} from 'three'
import { colourOf } from './colours.js'
import { stateAt } from './recording.js'

const GRID_MM = 50
const MARGIN = 1

// From in front of the bed, a little to the left.
export const FIRST = { azimuth: -1.75, elevation: 0.72, zoom: 1 }
export const ABOVE = { azimuth: -Math.PI / 2, elevation: Math.PI / 2 - 0.001, zoom: 1 }

export class View {
  constructor(canvas, recording) {
    this.canvas = canvas
    this.recording = recording
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true })
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2))
    this.scene = new Scene()
    this.camera = new PerspectiveCamera(28, 1, 10, 5000)
    this.camera.up.set(0, 0, 1)
    this.textures = new Map()
    this.#makeSheet()
    this.#makeBed()
    this.#makeLights()
    this.turn = { ...FIRST }
    this.state = this.setWay(0)
    new ResizeObserver(() => this.#resize()).observe(canvas)
    this.#resize()
  }

  #makeSheet() {
    const { rows, columns, frames, picture, error, stops, full_colour_mm: full } = this.recording
    const faces = []
    for (let r = 0; r + 1 < rows; r += 1) {
      for (let c = 0; c + 1 < columns; c += 1) {
        const a = r * columns + c
        faces.push(a, a + columns, a + 1, a + 1, a + columns, a + columns + 1)
      }
    }
    const colours = new Float32Array(frames[0].length)
    error.forEach((value, i) => {
      new Color().setRGB(...colourOf(stops, value / full), SRGBColorSpace).toArray(colours, 3 * i)
    })
    this.geometry = new BufferGeometry()
    this.positions = new BufferAttribute(new Float32Array(frames[0]), 3).setUsage(DynamicDrawUsage)
    this.geometry.setAttribute('position', this.positions)
    this.geometry.setAttribute('uv', new BufferAttribute(picture, 2))
    this.geometry.setAttribute('color', new BufferAttribute(colours, 3))
    this.geometry.setIndex(faces)
    this.printed = new MeshBasicMaterial({ side: DoubleSide })
    this.coloured = new MeshLambertMaterial({ side: DoubleSide, vertexColors: true })
    this.sheet = new Mesh(this.geometry, this.printed)
    this.scene.add(this.sheet)
  }

  // A raster on the bed, and where the sheet will lie.
  #makeBed() {
    const { rows, columns, frames } = this.recording
    const last = frames[frames.length - 1]
    const at = (r, c) => new Vector3(last[3 * (r * columns + c)], last[3 * (r * columns + c) + 1], -0.3)
    const border = []
    for (let c = 0; c < columns; c += 1) border.push(at(0, c))
    for (let r = 1; r < rows; r += 1) border.push(at(r, columns - 1))
    for (let c = columns - 2; c >= 0; c -= 1) border.push(at(rows - 1, c))
    for (let r = rows - 2; r > 0; r -= 1) border.push(at(r, 0))
    this.outline = new LineBasicMaterial()
    this.scene.add(new LineLoop(new BufferGeometry().setFromPoints(border), this.outline))

    const reach = 4 * GRID_MM
    const lines = []
    for (let x = -reach; x <= reach; x += GRID_MM) {
      lines.push(new Vector3(x, -reach, -0.6), new Vector3(x, reach, -0.6))
      lines.push(new Vector3(-reach, x, -0.6), new Vector3(reach, x, -0.6))
    }
    this.raster = new LineBasicMaterial()
    this.scene.add(new LineSegments(new BufferGeometry().setFromPoints(lines), this.raster))
  }

  // Together they leave a colour as the scale shows it where the sheet lies flat, and darken what is steep.
  #makeLights() {
    this.scene.add(new AmbientLight(0xffffff, 0.5 * Math.PI))
    const above = new DirectionalLight(0xffffff, 0.5 * Math.PI)
    above.position.set(0, 0, 1)
    this.scene.add(above)
  }

  setWay(way) {
    this.state = stateAt(this.recording, way, this.positions.array)
    this.positions.needsUpdate = true
    this.geometry.computeVertexNormals()
    this.geometry.computeBoundingSphere()
    return this.state
  }

  // The picture of a light: an <img> of the page itself.
  setPicture(image) {
    if (!this.textures.has(image)) {
      const texture = new Texture(image)
      texture.colorSpace = SRGBColorSpace
      texture.flipY = false
      texture.minFilter = LinearMipmapLinearFilter
      texture.anisotropy = this.renderer.capabilities.getMaxAnisotropy()
      texture.needsUpdate = true
      this.textures.set(image, texture)
    }
    this.printed.map = this.textures.get(image)
    this.printed.needsUpdate = true
  }

  showError(shown) {
    this.sheet.material = shown ? this.coloured : this.printed
  }

  setInk(outline, raster) {
    this.outline.color.set(outline)
    this.raster.color.set(raster)
  }

  turnBy(azimuth, elevation, zoom = 1) {
    const { turn } = this
    turn.azimuth += azimuth
    turn.elevation = Math.min(Math.max(turn.elevation + elevation, 0.08), ABOVE.elevation)
    turn.zoom = Math.min(Math.max(turn.zoom * zoom, 0.6), 5)
  }

  turnTo(turn) {
    this.turn = { ...turn }
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas
    if (!width || !height) return
    this.renderer.setSize(width, height, false)
    this.camera.aspect = width / height
    this.camera.updateProjectionMatrix()
    this.draw()
  }

  // As far away as the flat page needs to fit as it is first seen; the same however it is turned.
  #distance() {
    const [wide, deep] = this.recording.half_mm
    const up = Math.tan((this.camera.fov * Math.PI) / 360)
    const across = (wide * Math.abs(Math.sin(FIRST.azimuth)) + deep * Math.abs(Math.cos(FIRST.azimuth))) / this.camera.aspect
    const along = wide * Math.abs(Math.cos(FIRST.azimuth)) + deep * Math.abs(Math.sin(FIRST.azimuth))
    return (MARGIN * Math.max(across, along * Math.sin(FIRST.elevation))) / up + along * Math.cos(FIRST.elevation)
  }

  draw() {
    const { azimuth, elevation, zoom } = this.turn
    const distance = this.#distance() / zoom
    const flat = Math.cos(elevation)
    const [x, y] = this.recording.middle_mm
    this.camera.position.set(
      x + distance * flat * Math.cos(azimuth),
      y + distance * flat * Math.sin(azimuth),
      distance * Math.sin(elevation),
    )
    this.camera.lookAt(x, y, 0)
    this.renderer.render(this.scene, this.camera)
    this.canvas.dataset.heightMm = this.state.height_mm.toFixed(3)
  }
}
