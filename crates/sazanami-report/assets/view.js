// The three-dimensional view: grains as instances of their shapes, the surface of the water, a section, a slider over the times.
"use strict";
(async () => {
  const place = document.getElementById("stage"), say = document.getElementById("view-said");
  const bytesOf = async id => {
    const raw = Uint8Array.from(atob(document.getElementById(id).textContent), letter => letter.charCodeAt(0));
    return new Response(new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
  };
  const head = JSON.parse(document.getElementById("view-head").textContent);
  const buffer = await bytesOf("view-bytes");
  const kinds = { Uint16Array, Uint32Array, Float32Array };
  const array = ({ at, length, kind }) => new kinds[kind](buffer, at, length);
  const { count, times } = head, lower = head.lower, size = head.upper.map((x, d) => x - lower[d]);
  const summed = values => { for (let n = 1; n < values.length; n++) values[n] += values[n - 1]; return values; };
  const placed = (part, d) => lower[d] + size[d] * part / 65535;

  // Places and turns were stored as changes from time to time.
  const fixed = count ? Object.fromEntries(Object.entries(times.find(time => time.fixed).fixed).map(([name, of]) => [name, array(of)])) : {};
  let before;
  for (const time of times) if (time.grains) {
    time.grains = Object.fromEntries(Object.entries(time.grains).map(([name, of]) => [name, array(of)]));
    for (const name of ["place", "turn"]) if (before) time.grains[name].forEach((x, n, all) => { all[n] = x + before[name][n]; });
    before = time.grains;
  }

  let renderer;
  try { renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true, stencil: true }); } catch (problem) {
    say.textContent = "This browser shows no three-dimensional view: WebGL 2 is not available.";
    return;
  }
  document.getElementById("still")?.removeAttribute("open");
  document.getElementById("view-tools").hidden = false;
  const byId = id => document.getElementById(id);
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  const canvas = place.appendChild(renderer.domElement);
  Object.assign(canvas, { tabIndex: 0 });
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "Grains and water in three dimensions. Arrow keys turn the view, plus and minus come nearer and go away.");
  const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(35, 1, 1, 1);
  const middle = new THREE.Vector3(...lower.map((x, d) => x + size[d] / 2)), centre = middle.clone(), reach = Math.hypot(...size);
  Object.assign(camera, { near: reach / 200, far: reach * 20 });
  camera.up.set(0, 0, 1);
  // The whole box fills the view: of all its corners the one that asks for the most decides how far off the eye is. What is near looks
  // larger, so the middle of the picture is not that of the box: some steps find it.
  const corners = [...Array(8).keys()].map(n => new THREE.Vector3(...[0, 1, 2].map(d => lower[d] + size[d] * (n >> d & 1))));
  const framed = aspect => {
    const MARGIN = 1.05, tall = Math.tan(camera.fov * Math.PI / 360) / MARGIN, back = new THREE.Vector3(0.42, -1, head.crater ? 0.72 : 0.5).normalize();
    const right = new THREE.Vector3().crossVectors(camera.up, back).normalize(), up = new THREE.Vector3().crossVectors(back, right);
    const seen = () => corners.map(corner => [right, up, back].map(axis => corner.clone().sub(centre).dot(axis)));
    const far = ([x, y, z]) => z + Math.max(Math.abs(y) / tall, Math.abs(x) / (tall * aspect));
    centre.copy(middle);
    for (let n = 0; n < 5; n++) {
      const at = seen(), away = Math.max(...at.map(far));
      [right, up].forEach((axis, d) => { const parts = at.map(corner => corner[d] / (away - corner[2])); centre.addScaledVector(axis, away * (Math.min(...parts) + Math.max(...parts)) / 2); });
    }
    camera.position.copy(centre).addScaledVector(back, Math.max(...seen().map(far)));
    controls.target.copy(centre);
  };
  // As in the pictures of a run: a sun above the left shoulder of the eye and a lamp beside it, wherever that goes.
  scene.add(new THREE.AmbientLight(0xffffff, 1.0));
  const [sun, lamp] = [1.9, 0.9].map(bright => scene.add(new THREE.DirectionalLight(0xffffff, bright)) && scene.children[scene.children.length - 1]);
  const lit = () => {
    const [right, up, back] = [0, 1, 2].map(n => new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, n));
    lamp.position.copy(back);
    sun.position.set(0, 0, 1.15).addScaledVector(back, 0.35).addScaledVector(right, -0.75).addScaledVector(up, 0.2);
  };
  const plane = new THREE.Plane(new THREE.Vector3(0, 1, 0), 0), planes = [];
  const frame = new THREE.Box3Helper(new THREE.Box3(new THREE.Vector3(...lower), new THREE.Vector3(...head.upper)));
  scene.add(frame);
  const controls = new THREE.OrbitControls(camera, canvas);

  // A mesh of instances for each population.
  const geometry = ({ nodes, triangles }) => {
    const shape = new THREE.BufferGeometry();
    shape.setAttribute("position", new THREE.BufferAttribute(new Float32Array(nodes), 3));
    shape.setIndex(triangles);
    shape.computeVertexNormals();
    return shape;
  };
  const material = new THREE.MeshPhongMaterial({ side: THREE.DoubleSide, clippingPlanes: planes, shininess: 15 });
  renderer.localClippingEnabled = true;
  // Each shape once as it is and once with few triangles, for frames that would be slow and for grains of few pixels; both have the same
  // instances.
  const volumeOf = ({ nodes, triangles }) => {
    const at = n => new THREE.Vector3(...nodes.slice(3 * n, 3 * n + 3));
    let sum = 0;
    for (let n = 0; n < triangles.length; n += 3) sum += at(triangles[n]).dot(at(triangles[n + 1]).cross(at(triangles[n + 2]))) / 6;
    return Math.abs(sum);
  };
  const meshes = head.shapes.map((shape, population) => {
    const all = [...Array(count).keys()].filter(n => fixed.population[n] === population);
    const [fine, coarse] = [shape, shape.coarse ?? shape].map(of => new THREE.InstancedMesh(geometry(of), material, all.length));
    coarse.instanceMatrix = fine.instanceMatrix;
    fine.setColorAt(0, new THREE.Color());
    coarse.instanceColor = fine.instanceColor;
    for (const mesh of [fine, coarse]) {
      mesh.frustumCulled = false;
      scene.add(mesh);
    }
    return { fine, coarse, all, grains: all, volume: volumeOf(shape), reach: shape.nodes.reduce((most, x) => Math.max(most, Math.abs(x)), 0) };
  });
  const water = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshPhongMaterial({ color: 0x3b82d0, transparent: true, opacity: 0.5, side: THREE.DoubleSide, depthWrite: false, clippingPlanes: planes, shininess: 80 }));
  const drops = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: 0x3b82d0, size: reach / 250, transparent: true, opacity: 0.6, clippingPlanes: planes }));
  // Water and grains in the plane of the section: where a ray passes more of their back faces than of their front ones, by the stencil.
  const [ALWAYS, UNEQUAL, REPLACE, MORE, LESS] = [519, 517, 7681, 34055, 34056];
  const stencil = (stencilFunc, operation) => ({ stencilWrite: true, stencilRef: 0, stencilFunc, stencilFail: operation, stencilZFail: operation, stencilZPass: operation });
  const [back, front] = [[1, MORE], [0, LESS]].map(([side, operation]) => new THREE.MeshPhongMaterial({ side, transparent: true, colorWrite: false, depthWrite: false, depthTest: false, clippingPlanes: planes, ...stencil(ALWAYS, operation) }));
  const ordered = (object, renderOrder) => Object.assign(object, { frustumCulled: false, renderOrder });
  const lidOf = (colours, renderOrder) => ordered(new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshPhongMaterial({ ...colours, transparent: true, side: THREE.DoubleSide, ...stencil(UNEQUAL, REPLACE) })), renderOrder);
  const counts = [back, front].map(of => ordered(new THREE.Mesh(water.geometry, of), 1));
  const [lid, grainLid] = [lidOf({ color: 0x3b82d0, emissive: 0x1d4f8c, opacity: 0.75, depthWrite: false }, 2), lidOf({ color: 0xcdb58b, emissive: 0x4a3f2c }, 4)];
  // Of the grains those that the plane meets: the others count to nothing.
  for (const of of meshes) of.met = [back, front].map(face => ordered(new THREE.InstancedMesh(of.fine.geometry, face, of.all.length), 3));
  scene.add(water, drops, ...counts, lid, ...meshes.flatMap(of => of.met), grainLid);
  water.frustumCulled = drops.frustumCulled = false;

  // Colours of viridis (van der Walt and Smith 2015), at five places.
  const stops = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]].map(rgb => new THREE.Color(...rgb.map(c => c / 255)).convertSRGBToLinear());
  const tone = new THREE.Color();
  const coloured = part => {
    const x = Math.min(Math.max(part, 0), 1) * 4, n = Math.min(Math.floor(x), 3);
    return tone.copy(stops[n]).lerp(stops[n + 1], x - n);
  };
  const quantities = {
    height: { unit: "mm", of: time => Array.from({ length: count }, (_, n) => 1e3 * placed(time.grains.place[2 * count + n], 2)) },
    speed: { unit: "m/s", of: time => time.grains.speed }, force: { unit: "N", of: time => time.grains.force },
    size: { unit: "mm", of: () => fixed.diameter.map(x => 1e3 * x) },
  };
  // The same colours at all times: up to the value that one of two hundred grains exceeds.
  for (const quantity of Object.values(quantities)) {
    const all = times.filter(time => time.grains).flatMap(time => [...quantity.of(time)].filter((_, n) => n % Math.ceil(count / 5000) === 0)).sort((a, b) => a - b);
    Object.assign(quantity, { least: 0, most: all[Math.floor(0.995 * (all.length - 1))] || 1 });
  }
  [quantities.height.least, quantities.height.most] = head.heights;

  let chosen = times.length - 1, picked = -1, showsAll = false;
  const matrix = new THREE.Matrix4(), turn = new THREE.Quaternion(), at = new THREE.Vector3(), scaled = new THREE.Vector3();
  const pose = (grains, n) => {
    const parts = [0, 1, 2].map(d => (grains.turn[d * count + n] << 16 >> 16) / 32767);
    turn.set(...parts, Math.sqrt(Math.max(0, 1 - parts.reduce((sum, x) => sum + x * x, 0)))).normalize();
    at.set(...[0, 1, 2].map(d => placed(grains.place[d * count + n], d)));
    return matrix.compose(at, turn, scaled.setScalar(fixed.scale[n]));
  };
  const surface = of => {
    const nodes = summed(array(of.nodes).slice()), corners = nodes.length / 3;
    const places = new Float32Array(nodes.length);
    for (let d = 0; d < 3; d++) for (let n = 0; n < corners; n++) places[3 * n + d] = placed(nodes[d * corners + n], d);
    return geometry({ nodes: places, triangles: new THREE.BufferAttribute(summed(array(of.triangles).slice()), 1) });
  };
  const cloud = of => {
    const parts = array(of.particles), places = new Float32Array(3 * of.count);
    for (let d = 0; d < 3; d++) for (let n = 0; n < of.count; n++) places[3 * n + d] = placed(parts[d * of.count + n], d);
    return new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(places, 3));
  };
  // Grains that others hide on all sides are not drawn: on each of the six sides of their cell, about two grains wide, grains fill more
  // than a third of the nine cells there. What the section takes away hides nothing.
  const LEAST_FILLED = 0.35;
  const seen = grains => {
    const volume = n => meshes[fixed.population[n]].volume * fixed.scale[n] ** 3;
    const kept = [...Array(count).keys()].filter(n => planes.every(plane => plane.distanceToPoint(at.set(...[0, 1, 2].map(d => placed(grains.place[d * count + n], d)))) > -fixed.diameter[n] * 2));
    const mean = kept.reduce((sum, n) => sum + volume(n), 0) / kept.length, edge = 2 * Math.cbrt(mean);
    if (!(edge > 0)) return kept;
    const cells = size.map(x => Math.ceil(x / edge) + 2), filled = new Float32Array(cells[0] * cells[1] * cells[2]);
    const cell = n => [0, 1, 2].map(d => 1 + Math.floor(size[d] * grains.place[d * count + n] / 65535.001 / edge));
    const index = ([i, j, k]) => i + cells[0] * (j + cells[1] * k);
    // Cells at the sides of the box may be cut: they count as whole, and lie at the surface anyway.
    for (const n of kept) if (planes.every(plane => plane.distanceToPoint(at.set(...[0, 1, 2].map(d => placed(grains.place[d * count + n], d)))) >= 0)) filled[index(cell(n))] += volume(n) / edge ** 3;
    const steps = [1, cells[0], cells[0] * cells[1]], three = [-1, 0, 1];
    const sides = [0, 1, 2].flatMap(d => [-1, 1].map(sign => three.flatMap(a => three.map(b => sign * steps[d] + a * steps[(d + 1) % 3] + b * steps[(d + 2) % 3]))));
    return kept.filter(n => { const c = index(cell(n)); return sides.some(side => side.reduce((sum, step) => sum + filled[c + step], 0) < 9 * LEAST_FILLED); });
  };
  const arrange = () => {
    const time = times[chosen], quantity = quantities[byId("view-colour").value];
    if (!time.grains) return;
    const values = quantity.of(time), shown = showsAll ? null : new Set(seen(time.grains));
    for (const of of meshes) {
      const { fine, coarse } = of;
      of.grains = shown ? of.all.filter(n => shown.has(n)) : of.all;
      of.grains.forEach((n, instance) => {
        fine.setMatrixAt(instance, pose(time.grains, n));
        fine.setColorAt(instance, n === picked ? tone.setRGB(1, 0, 0) : coloured((values[n] - quantity.least) / (quantity.most - quantity.least)));
      });
      for (const mesh of [fine, coarse]) Object.assign(mesh, { count: of.grains.length, boundingSphere: null });
      const [first, second] = of.met, isMet = n => planes.length > 0 && pose(time.grains, n) && Math.abs(plane.distanceToPoint(at)) < 1.8 * of.reach * fixed.scale[n];
      const met = of.all.filter(isMet);
      met.forEach((n, instance) => first.setMatrixAt(instance, pose(time.grains, n)));
      second.instanceMatrix = first.instanceMatrix;
      first.count = second.count = met.length;
      first.instanceMatrix.needsUpdate = true;
      fine.instanceMatrix.needsUpdate = fine.instanceColor.needsUpdate = true;
    }
  };
  const show = () => {
    const time = times[chosen], quantity = quantities[byId("view-colour").value];
    arrange();
    [[water, time.water?.nodes && surface], [drops, time.water?.particles && cloud]].forEach(([object, made]) => {
      object.geometry.dispose();
      object.geometry = made ? made(time.water) : new THREE.BufferGeometry();
      object.visible = Boolean(made) && byId("view-water").checked;
    });
    counts.forEach(object => { object.geometry = water.geometry; });
    capped();
    byId("view-time-said").textContent = `t = ${+(1e3 * time.time).toPrecision(5)} ms`;
    byId("view-scale-said").textContent = `${reportRaised(String(+quantity.least.toPrecision(3)))} to ${reportRaised(String(+quantity.most.toPrecision(3)))} ${quantity.unit}`;
    tell();
    render();
  };
  // Few triangles while the view turns, if whole shapes take too long, and for grains of a few pixels.
  const SLOW = 1000 / 30, SMALL = 6;
  let isMoving = false, isSlow = false, isAsked = false, isTurned = false;
  const isCoarse = of => {
    const pixels = 2 * of.reach * canvas.height / (2 * Math.tan(camera.fov * Math.PI / 360) * camera.position.distanceTo(centre));
    return (isMoving && isSlow) || pixels < SMALL;
  };
  // However many events ask for it: a picture a frame, and none while nothing changes.
  const render = () => {
    if (isAsked) return;
    isAsked = true;
    const asked = performance.now();
    requestAnimationFrame(() => {
      isAsked = false;
      draw();
      requestAnimationFrame(() => { if (isMoving && performance.now() - asked > 2 * SLOW) isSlow = true; });
    });
  };
  const draw = () => {
    for (const of of meshes) {
      const isShown = byId("view-grains").checked && Boolean(times[chosen].grains), coarse = isCoarse(of);
      of.fine.visible = isShown && !coarse;
      of.coarse.visible = isShown && coarse;
    }
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    scene.background = tone.set(dark ? 0x0d1117 : 0xf6f8fa).clone();
    frame.material.color.set(dark ? 0x6e7681 : 0x8c959f);
    camera.updateMatrixWorld();
    lit();
    renderer.render(scene, camera);
  };
  const numbers = n => {
    const { grains } = times[chosen];
    return { id: fixed.id[n], population: head.populations[fixed.population[n]] ?? "", position_mm: [0, 1, 2].map(d => 1e3 * placed(grains.place[d * count + n], d)),
      speed: grains.speed[n], force: grains.force[n], diameter_mm: 1e3 * fixed.diameter[n] };
  };
  const tell = () => {
    if (picked < 0 || !times[chosen].grains) return;
    const { id, population, position_mm, speed, force, diameter_mm } = numbers(picked);
    say.textContent = `Grain ${id} (${population}): at ${position_mm.map(x => x.toFixed(3)).join(", ")} mm; speed ${reportRaised(speed.toPrecision(6))} m/s; contact force ${reportRaised(force.toPrecision(6))} N; diameter ${diameter_mm.toPrecision(6)} mm`;
  };
  const ray = new THREE.Raycaster();
  const pick = event => {
    const box = canvas.getBoundingClientRect();
    ray.setFromCamera(new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height), camera);
    draw();
    const drawn = meshes.flatMap(({ fine, coarse, grains }) => [fine, coarse].filter(mesh => mesh.visible).map(mesh => Object.assign(mesh, { grains })));
    const hits = ray.intersectObjects(drawn).filter(hit => planes.every(plane => plane.distanceToPoint(hit.point) >= 0));
    picked = hits.length ? hits[0].object.grains[hits[0].instanceId] : -1;
    if (picked < 0) say.textContent = "Press on a grain to see its numbers.";
    show();
  };
  // The part of the plane of the section within the box, in which water is filled in.
  const capped = () => {
    const d = +byId("view-axis").value, hasGrains = byId("view-grains").checked && Boolean(times[chosen].grains);
    for (const object of [...counts, lid]) object.visible = planes.length > 0 && water.visible;
    for (const object of [...meshes.flatMap(of => of.met), grainLid]) object.visible = planes.length > 0 && hasGrains;
    if (!planes.length) return;
    const [a, b] = [0, 1, 2].filter(k => k !== d), nodes = [];
    for (const [u, v] of [[0, 0], [1, 0], [1, 1], [0, 1]]) {
      const node = [0, 0, 0];
      node[d] = -plane.constant;
      node[a] = lower[a] + u * size[a];
      node[b] = lower[b] + v * size[b];
      nodes.push(...node);
    }
    lid.geometry.dispose();
    lid.geometry = grainLid.geometry = geometry({ nodes, triangles: [0, 1, 2, 0, 2, 3] });
  };
  const cut = () => {
    const axis = byId("view-axis").value, slider = byId("view-cut");
    slider.disabled = axis === "none";
    planes.length = 0;
    if (axis !== "none") {
      const d = +axis;
      plane.normal.set(...[0, 1, 2].map(k => k === d ? 1 : 0));
      plane.constant = -(lower[d] + size[d] * slider.value / 100);
      planes.push(plane);
    }
    [material, water.material, drops.material, back, front].forEach(of => { of.clippingPlanes = planes.length ? [...planes] : null; of.needsUpdate = true; });
    arrange();
    capped();
    render();
  };
  const turnBy = event => {
    const away = new THREE.Spherical().setFromVector3(camera.position.clone().sub(centre).applyAxisAngle(new THREE.Vector3(1, 0, 0), -Math.PI / 2));
    const step = { ArrowLeft: [-0.1, 0, 1], ArrowRight: [0.1, 0, 1], ArrowUp: [0, -0.1, 1], ArrowDown: [0, 0.1, 1], "+": [0, 0, 0.9], "-": [0, 0, 1.1] }[event.key];
    if (!step) return;
    event.preventDefault();
    isTurned = true;
    away.theta += step[0];
    away.phi = Math.min(Math.PI - 0.05, Math.max(0.05, away.phi + step[1]));
    away.radius *= step[2];
    camera.position.setFromSpherical(away).applyAxisAngle(new THREE.Vector3(1, 0, 0), Math.PI / 2).add(centre);
    controls.update();
    render();
  };

  const slider = byId("view-time");
  Object.assign(slider, { max: times.length - 1, value: chosen });
  slider.addEventListener("input", () => { chosen = +slider.value; show(); });
  let playing = 0;
  byId("view-play").addEventListener("click", event => {
    event.target.textContent = playing ? "Play" : "Stop";
    playing = playing ? clearInterval(playing) ?? 0 : setInterval(() => { chosen = (chosen + 1) % times.length; slider.value = chosen; show(); }, 400);
  });
  for (const id of ["view-colour", "view-grains", "view-water"]) byId(id).addEventListener("change", show);
  for (const id of ["view-axis", "view-cut"]) byId(id).addEventListener("input", cut);
  controls.addEventListener("change", render);
  controls.addEventListener("start", () => { isMoving = isTurned = true; });
  controls.addEventListener("end", () => { isMoving = false; render(); });
  canvas.addEventListener("keydown", turnBy);
  let pressed = [0, 0];
  canvas.addEventListener("pointerdown", event => { pressed = [event.clientX, event.clientY]; });
  canvas.addEventListener("click", event => { if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4) pick(event); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", render);
  const fit = () => {
    const width = place.clientWidth, height = Math.min(0.62 * width + 60, 0.7 * innerHeight);
    if (!(width > 0 && height > 0)) return;
    renderer.setSize(width, height);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    if (!isTurned) framed(camera.aspect);
    controls.update();
    draw();
  };
  if (head.crater) byId("view-axis").value = "1";
  byId("view-water").parentElement.hidden = !times.some(time => time.water);
  new ResizeObserver(fit).observe(place);
  fit();
  cut();
  show();
  draw();
  // For tests: what is drawn, where a grain is on the screen, what frames take, and the picture with and without hidden grains.
  const frames = (number, coarse) => {
    const began = performance.now(), gl = renderer.getContext(), pixel = new Uint8Array(4);
    [isMoving, isSlow] = [coarse, coarse];
    for (let n = 0; n < number; n++) {
      camera.position.sub(centre).applyAxisAngle(camera.up, 1e-3).add(centre);
      draw();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    }
    [isMoving, isSlow] = [false, false];
    return { perSecond: number / (performance.now() - began) * 1e3, triangles: renderer.info.render.triangles, calls: renderer.info.render.calls };
  };
  const picture = all => {
    const gl = renderer.getContext(), pixels = new Uint8Array(4 * canvas.width * canvas.height);
    showsAll = all;
    arrange();
    draw();
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  };
  window.reportView = {
    head, numbers, frames, capped: () => lid.visible, all: number => { picture(true); const found = frames(number, false); picture(false); return found; }, get picked() { return picked; }, get calls() { return renderer.info.render; }, corners: () => { camera.updateMatrixWorld(); return corners.map(corner => corner.clone().project(camera)).flatMap(({ x, y }) => [Math.abs(x), Math.abs(y)]); }, get drawn() { return meshes.map(of => of.grains.length); },
    seen: n => { const box = canvas.getBoundingClientRect(); const p = at.set(...numbers(n).position_mm.map(x => x / 1e3)).clone().project(camera); return [box.left + (p.x + 1) / 2 * box.width, box.top + (1 - p.y) / 2 * box.height]; },
    // Part of the pixels that differ by more than a tenth where hidden grains are drawn as well.
    missed: () => { const [with_, without] = [picture(true), picture(false)]; let sum = 0; for (let n = 0; n < with_.length; n += 4) sum += [0, 1, 2].some(c => Math.abs(with_[n + c] - without[n + c]) > 25); return 4 * sum / with_.length; },
  };
})();
