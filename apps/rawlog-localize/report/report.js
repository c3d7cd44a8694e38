'use strict';
// The behaviour of report.html. Lengths are in m and angles in rad, in the map frame, unless a name says otherwise.

const kStatuses = ['localized', 'ambiguous', 'rejected', 'invalid'];
const kStatusColors = ['#0072b2', '#e69f00', '#c1121f', '#777777'];
// What the beam model thinks of a beam, in the order of classify().
const kBeamKinds = [
  {name: 'on a wall', color: '#0a9d58'}, {name: 'beside a wall', color: '#9acd32'}, {name: 'object', color: '#f77f00'},
  {name: 'through a wall', color: '#d00000'}, {name: 'in unknown space', color: '#8338ec'}, {name: 'no return', color: '#999999'}];
const kOnWall = 0, kBesideWall = 1, kObject = 2, kThroughWall = 3, kUnknown = 4, kNoReturn = 5;
const kOccupied = 1, kUnknownCell = 2;
const kRowHeight = 22;  // [pixel]
// The columns of the places of a frame, and what they mean.
const kPlaceColumns = [
  ['place', 'a hypothesis by its rank, the scan alone, the particle filter, or the ground truth'],
  ['prob.', 'probability that the robot is there'], ['x [m]', 'in the frame of the map'], ['y [m]', 'in the frame of the map'],
  ['phi [°]', 'yaw of the robot, counter-clockwise from the x axis'],
  ['explained', 'share of the returns that end at a wall and passed none'], ['error', 'distance to the ground truth']];

const $ = id => document.getElementById(id);
let run, cells, scans;  // what the file holds: results, classes of cells, packed scans with the place of each
let shown = [];  // frames that pass the filters
let passes, drawnX, drawnY, wrong;  // by frame: 1 if it passes them; where it is drawn, NaN if nowhere; 1 if its pose is off
let selected = -1, place = 0;  // the frame, and which of its places the scan is laid at
const view = {scale: 20, x: 0, y: 0, fitted: 20};  // [pixel/m], and the middle of the picture

// ---- Reading ---------------------------------------------------------------------------------------------------------

async function unpack(id) {
  const text = atob($(id).textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  $(id).remove();
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Response(stream).arrayBuffer();
}

// The words of a scan are written by words_of() in report_html.cpp.
function findScans(buffer) {
  const words = new Uint16Array(buffer), starts = [];
  for (let at = 0; at < words.length; at += 4 + 2 * words[at]) starts.push(at);
  return {words, starts};
}

function scanOf(frame) {
  const {words, starts} = scans, at = starts[frame], count = words[at], signed = new Int16Array(words.buffer);
  const scan = {x: signed[at + 1] / 1e3, y: signed[at + 2] / 1e3, phi: signed[at + 3] / 1e4, beams: []};
  let angle = 0, range = 0;
  for (let i = 0; i < count; i++) {
    angle = angle + words[at + 4 + i] & 0xffff;
    range = range + words[at + 4 + count + i] & 0xffff;
    scan.beams.push({angle: angle * 2 * Math.PI / 65536, range: (range >> 1) / 100, isReturn: (range & 1) === 1});
  }
  return scan;
}

// ---- The frames ------------------------------------------------------------------------------------------------------

const wrapped = angle => Math.atan2(Math.sin(angle), Math.cos(angle));
const degrees = angle => angle * 180 / Math.PI;
const hasPose = f => run.past_hypothesis[f] > (f > 0 ? run.past_hypothesis[f - 1] : 0);

function hypothesesOf(f) {
  const list = [], h = run.hypotheses;
  for (let i = f > 0 ? run.past_hypothesis[f - 1] : 0; i < run.past_hypothesis[f]; i++)
    list.push({x: h[5 * i], y: h[5 * i + 1], phi: h[5 * i + 2], probability: h[5 * i + 3], explained: h[5 * i + 4]});
  return list;
}

function poseOf(f) {
  if (!hasPose(f)) return null;
  const i = 5 * (f > 0 ? run.past_hypothesis[f - 1] : 0);
  return {x: run.hypotheses[i], y: run.hypotheses[i + 1], phi: run.hypotheses[i + 2]};
}

function truthOf(f) {
  if (!run.truth || run.truth[3 * f] === null) return null;
  return {x: run.truth[3 * f], y: run.truth[3 * f + 1], phi: run.truth[3 * f + 2]};
}

// What an answer about each frame, such as run.alone, says of a frame.
function answerOf(a, f) {
  if (!a || a[5 * f] === null) return null;
  const pose = a[5 * f + 2] === null ? null : {x: a[5 * f + 2], y: a[5 * f + 3], phi: a[5 * f + 4]};
  return {status: a[5 * f], confidence: a[5 * f + 1], pose};
}

function fusedOf(f) {
  const a = run.fused;
  if (!a || a[5 * f] === null) return null;
  return {status: a[5 * f], probability: a[5 * f + 1], x: a[5 * f + 2], y: a[5 * f + 3], phi: a[5 * f + 4]};
}

function errorOf(f, pose) {
  const truth = truthOf(f);
  if (!truth || !pose) return null;
  return {position: Math.hypot(pose.x - truth.x, pose.y - truth.y), yaw: Math.abs(degrees(wrapped(pose.phi - truth.phi)))};
}

const isWrong = error => error !== null && (error.position >= run.tolerance[0] || error.yaw >= run.tolerance[1]);

// Everything that the scan of a frame can be laid at: hypotheses first.
function placesOf(f) {
  const places = hypothesesOf(f).map((h, i) => ({...h, name: String(i + 1), isHypothesis: true}));
  const alone = answerOf(run.alone, f), tracked = answerOf(run.tracked, f), fused = fusedOf(f), truth = truthOf(f);
  if (alone && alone.pose)
    places.push({...alone.pose, name: 'alone: ' + kStatuses[alone.status], probability: alone.confidence, color: '#00a6a6'});
  if (tracked && tracked.pose)
    places.push({...tracked.pose, name: 'tracked: ' + kStatuses[tracked.status], probability: tracked.confidence, color: '#b05a00'});
  if (fused) places.push({...fused, name: 'fused: ' + fused.status, color: '#a100a1'});
  if (truth) places.push({...truth, name: 'truth', color: '#111111'});
  return places;
}

// ---- What the beam model thinks --------------------------------------------------------------------------------------

function cellAt(column, row) {
  return column >= 0 && row >= 0 && column < run.width && row < run.height ? cells[row * run.width + column] : kUnknownCell;
}

function distanceToWall(x, y) {
  const size = run.cell_size, reach = Math.ceil(0.2 / size) + 1;
  const column = Math.floor((x - run.origin[0]) / size), row = Math.floor((y - run.origin[1]) / size);
  let nearest = Infinity;
  for (let j = row - reach; j <= row + reach; j++)
    for (let i = column - reach; i <= column + reach; i++)
      if (cellAt(i, j) === kOccupied)
        nearest = Math.min(nearest, Math.hypot(run.origin[0] + (i + 0.5) * size - x, run.origin[1] + (j + 0.5) * size - y));
  return nearest;
}

// Whether a beam passes a run of occupied cells over a cell or more, and leaves it 0.15 m before its end, as in
// beam_tracer.h.
function passesWall(x, y, angle, range) {
  const size = run.cell_size, c = Math.cos(angle), s = Math.sin(angle), end = range / size;
  const u = (x - run.origin[0]) / size, v = (y - run.origin[1]) / size;
  let i = Math.floor(u), j = Math.floor(v), inWall = 0, length = 0;
  const stepI = c > 0 ? 1 : -1, stepJ = s > 0 ? 1 : -1, deltaI = Math.abs(1 / c), deltaJ = Math.abs(1 / s);
  let nextI = (c > 0 ? i + 1 - u : u - i) * deltaI, nextJ = (s > 0 ? j + 1 - v : v - j) * deltaJ;
  while (length < end) {
    const isWall = cellAt(i, j) === kOccupied, next = Math.min(nextI, nextJ, end);
    if (!isWall && inWall > 0.99 && length < end - 0.15 / size) return true;
    inWall = isWall ? inWall + next - length : 0;
    length = next;
    if (nextI < nextJ) { i += stepI; nextI += deltaI; } else { j += stepJ; nextJ += deltaJ; }
  }
  return false;
}

// The scan laid at a pose of the robot: the sensor, and where each beam ends and what kind it is.
function lay(scan, pose) {
  const c = Math.cos(pose.phi), s = Math.sin(pose.phi);
  const sensor = {x: pose.x + c * scan.x - s * scan.y, y: pose.y + s * scan.x + c * scan.y, phi: pose.phi + scan.phi};
  const ends = scan.beams.map(beam => {
    const angle = sensor.phi + beam.angle;
    const x = sensor.x + beam.range * Math.cos(angle), y = sensor.y + beam.range * Math.sin(angle);
    return {x, y, kind: beam.isReturn ? classify(sensor, angle, beam.range, x, y) : kNoReturn};
  });
  return {sensor, ends};
}

function classify(sensor, angle, range, x, y) {
  if (passesWall(sensor.x, sensor.y, angle, range)) return kThroughWall;
  const distance = distanceToWall(x, y), size = run.cell_size;
  if (distance < 0.1) return kOnWall;
  if (cellAt(Math.floor((x - run.origin[0]) / size), Math.floor((y - run.origin[1]) / size)) === kUnknownCell) return kUnknown;
  return distance < 0.2 ? kBesideWall : kObject;
}

// ---- The map picture -------------------------------------------------------------------------------------------------

// The map, and each time half as large; what a halved cell was made of decides: a wall if there is one, else free space.
// A picture is painted when it is drawn first.
const levels = [];

function halved({width, height, classes}) {
  const half = {width: Math.ceil(width / 2), height: Math.ceil(height / 2)};
  half.classes = new Uint8Array(half.width * half.height).fill(kUnknownCell);
  for (let row = 0; row < height; row++)
    for (let column = 0; column < width; column++) {
      const at = (row >> 1) * half.width + (column >> 1), one = classes[row * width + column];
      if (one === kOccupied || (one === 0 && half.classes[at] !== kOccupied)) half.classes[at] = one;
    }
  return half;
}

function makeLevels() {
  levels.push({width: run.width, height: run.height, classes: cells});
  while (Math.max(levels.at(-1).width, levels.at(-1).height) >= 800) levels.push(halved(levels.at(-1)));
}

function pictureOf(level) {
  if (level.picture) return level.picture;
  const {width, height, classes} = level, picture = level.picture = document.createElement('canvas');
  picture.width = width;
  picture.height = height;
  const context = picture.getContext('2d'), image = context.createImageData(width, height);
  const pixels = new Uint32Array(image.data.buffer), colors = [0xffffffff, 0xff303030, 0xffcdcdcd];
  for (let row = 0; row < height; row++)  // the first row of the picture is the one of greatest y
    for (let column = 0; column < width; column++)
      pixels[(height - 1 - row) * width + column] = colors[classes[row * width + column]];
  context.putImageData(image, 0, 0);
  return picture;
}

const pixelX = x => (x - view.x) * view.scale + canvasSize.width / 2;
const pixelY = y => (view.y - y) * view.scale + canvasSize.height / 2;
const canvasSize = {width: 1, height: 1};

function drawMap(g) {
  const level = Math.max(0, Math.min(levels.length - 1, Math.floor(Math.log2(1 / (view.scale * run.cell_size * devicePixelRatio)) + 0.5)));
  const picture = pictureOf(levels[level]), size = run.cell_size * 2 ** level;
  g.imageSmoothingEnabled = view.scale * size < 1;
  g.drawImage(
    picture, pixelX(run.origin[0]), pixelY(run.origin[1] + picture.height * size),
    picture.width * size * view.scale, picture.height * size * view.scale);
}

// The poses of all frames, faint if they do not pass the filters.
function drawPath(g) {
  const side = view.scale > 3 * view.fitted ? 7 : run.index.length > 3000 ? 3 : 5;
  if (run.truth) drawSquares(g, f => true, f => run.truth[3 * f], f => run.truth[3 * f + 1], 'rgba(0, 0, 0, .18)', 6);
  for (const pass of [0, 1])
    for (let status = 3; status >= 0; status--) {
      g.globalAlpha = pass ? 0.9 : 0.12;
      drawSquares(
        g, f => run.status[f] === status && passes[f] === pass, f => drawnX[f], f => drawnY[f], kStatusColors[status], side);
    }
  g.globalAlpha = 1;
  g.strokeStyle = '#c1121f';  // from where the robot was to a localized pose that is off
  g.lineWidth = 1.5;
  g.beginPath();
  for (const f of shown) {
    if (!wrong[f] || run.status[f] !== 0) continue;
    g.moveTo(pixelX(run.truth[3 * f]), pixelY(run.truth[3 * f + 1]));
    g.lineTo(pixelX(drawnX[f]), pixelY(drawnY[f]));
  }
  g.stroke();
}

// Draws a square at each of the chosen frames that lies in the picture and not on another one.
function drawSquares(g, isChosen, xOf, yOf, color, side) {
  const columns = Math.ceil(canvasSize.width / 2), rows = Math.ceil(canvasSize.height / 2), taken = new Uint8Array(columns * rows);
  g.fillStyle = color;
  for (let f = 0; f < run.index.length; f++) {
    if (!isChosen(f) || xOf(f) === null) continue;
    const x = pixelX(xOf(f)), y = pixelY(yOf(f));
    if (!(x >= 0 && y >= 0 && x < canvasSize.width && y < canvasSize.height)) continue;
    const at = (y >> 1) * columns + (x >> 1);
    if (taken[at]) continue;
    taken[at] = 1;
    g.fillRect(x - side / 2, y - side / 2, side, side);
  }
}

function drawRobot(g, pose, color, radius) {
  const x = pixelX(pose.x), y = pixelY(pose.y);
  g.beginPath();
  g.arc(x, y, radius, 0, 2 * Math.PI);
  g.fillStyle = color;
  g.fill();
  g.strokeStyle = '#ffffff';
  g.lineWidth = 2;
  g.stroke();
  g.beginPath();
  g.moveTo(x, y);
  g.lineTo(x + 2.4 * radius * Math.cos(pose.phi), y - 2.4 * radius * Math.sin(pose.phi));
  g.strokeStyle = color;
  g.lineWidth = 3;
  g.stroke();
}

const kLabelPaper = 'rgba(255, 255, 255, .85)';

// The label stands to the right of the pose, but stays in the picture if the pose does.
function drawLabel(g, pose, text) {
  const width = g.measureText(text).width, at = pixelX(pose.x), y = pixelY(pose.y) - 10;
  const x = at < canvasSize.width ? Math.min(at + 12, canvasSize.width - width - 4) : at + 12;
  g.fillStyle = kLabelPaper;
  g.fillRect(x - 3, y - 12, width + 6, 16);
  g.fillStyle = '#222222';
  g.fillText(text, x, y);
}

// Beams from the sensor to their ends; where nothing was seen they are thin.
function drawScan(g, laid) {
  for (let kind = kNoReturn; kind >= 0; kind--) {
    g.strokeStyle = g.fillStyle = kBeamKinds[kind].color;
    g.lineWidth = 1;
    g.globalAlpha = kind === kNoReturn ? 0.15 : 0.28;
    g.beginPath();
    for (const end of laid.ends) {
      if (end.kind !== kind) continue;
      g.moveTo(pixelX(laid.sensor.x), pixelY(laid.sensor.y));
      g.lineTo(pixelX(end.x), pixelY(end.y));
    }
    g.stroke();
    g.globalAlpha = 1;
    if (kind === kNoReturn) continue;
    for (const end of laid.ends) if (end.kind === kind) g.fillRect(pixelX(end.x) - 2.5, pixelY(end.y) - 2.5, 5, 5);
  }
}

// The chosen place with coloured beams; the scan at rival places as faint points, with their probabilities.
function drawSelected(g) {
  if (selected < 0) return;
  const places = placesOf(selected), scan = scanOf(selected), color = kStatusColors[run.status[selected]];
  g.font = '12px system-ui, "DejaVu Sans", sans-serif';
  places.forEach((p, i) => {
    if (i === place || !p.isHypothesis) return;
    const laid = lay(scan, p);
    g.globalAlpha = 0.25 + 0.5 * p.probability;
    g.fillStyle = color;
    for (const end of laid.ends) if (end.kind !== kNoReturn) g.fillRect(pixelX(end.x) - 1.5, pixelY(end.y) - 1.5, 3, 3);
    g.globalAlpha = 1;
  });
  if (places[place]) drawScan(g, lay(scan, places[place]));
  places.forEach((p, i) => {
    if (i !== place) drawRobot(g, p, p.color || color, 5);
  });
  if (places[place]) drawRobot(g, places[place], places[place].color || color, 7);
  places.forEach((p, i) => {
    if (p.isHypothesis && (i === place || p.probability >= 0.01)) drawLabel(g, p, `${p.name}: ${percent(p.probability)}`);
  });
}

function drawScaleBar(g) {
  const most = 150 / view.scale, power = 10 ** Math.floor(Math.log10(most));
  const metres = [5, 2, 1].map(step => step * power).find(length => length <= most), x = canvasSize.width - 20, y = canvasSize.height - 44;
  g.fillStyle = kLabelPaper;
  g.fillRect(x - metres * view.scale - 6, y - 18, metres * view.scale + 12, 23);
  g.strokeStyle = g.fillStyle = '#222222';
  g.lineWidth = 2;
  g.beginPath();
  g.moveTo(x, y - 5);
  g.lineTo(x, y);
  g.lineTo(x - metres * view.scale, y);
  g.lineTo(x - metres * view.scale, y - 5);
  g.stroke();
  g.fillText(`${+metres.toPrecision(1)} m`, x - metres * view.scale + 4, y - 5);
}

// ---- The timeline ----------------------------------------------------------------------------------------------------

const kTimelineMargin = 12;  // [pixel]

function frameX(f, width) {
  return kTimelineMargin + (f + 0.5) / run.index.length * (width - 2 * kTimelineMargin);
}

// The bars of all frames are drawn anew only if the filters or the size change.
const timelinePicture = {canvas: document.createElement('canvas'), shown: null, width: 0, height: 0};

function drawTimeline() {
  const {g, width, height} = sized($('timeline')), picture = timelinePicture;
  if (picture.shown !== shown || picture.width !== width || picture.height !== height) {
    Object.assign(picture, {shown, width, height});
    picture.canvas.width = width * devicePixelRatio;
    picture.canvas.height = height * devicePixelRatio;
    const bars = picture.canvas.getContext('2d');
    bars.scale(devicePixelRatio, devicePixelRatio);
    drawBars(bars, width, height);
  }
  g.clearRect(0, 0, width, height);
  g.drawImage(picture.canvas, 0, 0, width, height);
  if (selected < 0) return;
  g.fillStyle = '#111111';
  g.fillRect(frameX(selected, width) - 1, 2, 2, height - 18);
}

function drawBars(g, width, height) {
  const bottom = height - 26, top = 10, bar = Math.max(1, (width - 2 * kTimelineMargin) / run.index.length * 0.9);
  for (let f = 0; f < run.index.length; f++) {
    const length = Math.max(3, run.confidence[f] * (bottom - top));
    g.globalAlpha = passes[f] ? 1 : 0.12;
    g.fillStyle = kStatusColors[run.status[f]];
    g.fillRect(frameX(f, width) - bar / 2, bottom - length, bar, length);
    if (!wrong[f]) continue;
    g.fillStyle = '#c1121f';
    g.fillRect(frameX(f, width) - Math.max(bar, 2) / 2, bottom + 2, Math.max(bar, 2), 5);
  }
  g.globalAlpha = 1;
  g.fillStyle = '#555555';
  g.font = '11px system-ui, "DejaVu Sans", sans-serif';
  const range = `frames ${run.index[0]} to ${run.index[run.index.length - 1]}`;
  g.fillText(`confidence of ${range}` + (run.truth ? '; red below: the pose is off' : ''), kTimelineMargin, height - 4);
}

// ---- Lists and words -------------------------------------------------------------------------------------------------

const percent = share => share === null ? '' : share > 0.999 ? '100 %' : `${(100 * share).toFixed(share < 0.1 ? 1 : 0)} %`;

function element(tag, text, attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  return Object.assign(made, attributes);
}

function dot(color) {
  const made = element('span', '', {className: 'dot'});
  made.style.background = color;
  return made;
}

function drawList() {
  const list = $('list'), rows = $('rows');
  rows.style.height = `${shown.length * kRowHeight}px`;
  const first = Math.max(0, Math.floor(list.scrollTop / kRowHeight) - 5);
  const past = Math.min(shown.length, first + Math.ceil(list.clientHeight / kRowHeight) + 10);
  rows.replaceChildren();
  for (let i = first; i < past; i++) {
    const f = shown[i], error = errorOf(f, poseOf(f));
    const row = element('div', '', {className: f === selected ? 'row selected' : 'row'});
    row.style.top = `${i * kRowHeight}px`;
    row.dataset.frame = f;
    const status = element('span', '');
    status.append(dot(kStatusColors[run.status[f]]), kStatuses[run.status[f]]);
    row.append(
      element('span', run.index[f]), element('span', run.time[f].toFixed(2)), status,
      element('span', hasPose(f) ? run.confidence[f].toFixed(2) : ''),
      element('span', error ? `${error.position.toFixed(2)} m, ${error.yaw.toFixed(1)}°` : '', {className: isWrong(error) ? 'wrong' : ''}));
    rows.append(row);
  }
}

function drawDetails() {
  const details = $('details');
  details.replaceChildren();
  if (selected < 0) {
    details.append('Click a frame on the map, in the list or in the timeline; arrow keys step through the frames.');
    return;
  }
  const title = element('div', '');
  title.append(
    dot(kStatusColors[run.status[selected]]), element('b', `frame ${run.index[selected]}: ${kStatuses[run.status[selected]]}`),
    `  confidence ${run.confidence[selected].toFixed(3)}, ${run.milliseconds[selected]} ms`);
  details.append(title);
  if (run.notes[selected]) details.append(element('div', run.notes[selected]));
  const places = placesOf(selected);
  if (!hasPose(selected)) details.append(element('div', places.length > 0
    ? 'This frame has no pose. The map shows its scan at the place that is chosen below.'
    : 'The map does not show the scan, because there is no pose to lay it at.'));
  if (places.length === 0) return;
  const table = element('table', ''), head = element('tr', '');
  for (const [name, title] of kPlaceColumns)
    if (run.truth || name !== 'error') head.append(element('th', name, {title}));
  table.append(head);
  places.forEach((p, i) => {
    const row = element('tr', '', {className: i === place ? 'place shown' : 'place'}), error = errorOf(selected, p);
    row.dataset.place = i;
    const texts = [p.name, p.probability === undefined ? '' : percent(p.probability), p.x.toFixed(2), p.y.toFixed(2), degrees(wrapped(p.phi)).toFixed(1),
      p.explained === undefined ? '' : percent(p.explained)];
    if (run.truth) texts.push(error ? `${error.position.toFixed(2)} m` : '');
    texts.forEach((text, k) => row.append(element('td', text, {className: k === 6 && isWrong(error) ? 'wrong' : ''})));
    table.append(row);
  });
  details.append(table);
}

function drawLegend() {
  const legend = $('legend');
  legend.replaceChildren();
  const places = selected < 0 ? [] : placesOf(selected);
  if (!places[place]) {
    kStatuses.forEach((name, i) => {
      const entry = element('div', '');
      entry.append(dot(kStatusColors[i]), name);
      legend.append(entry);
    });
    return;
  }
  const counts = kBeamKinds.map(() => 0);
  for (const end of lay(scanOf(selected), places[place]).ends) counts[end.kind]++;
  kBeamKinds.forEach((kind, i) => {
    if (counts[i] === 0) return;
    const entry = element('div', '');
    entry.append(dot(kind.color), `${kind.name} (${counts[i]})`);
    legend.append(entry);
  });
}

function drawSummary() {
  const count = status => run.status.reduce((sum, s) => sum + (s === status), 0);
  const texts = kStatuses.map((name, i) => `${name} ${count(i)} (${(100 * count(i) / run.index.length).toFixed(1)} %)`);
  const window = run.window ? `, window of ${run.window}` : '';
  $('summary').textContent = $('summary').title = `${run.index.length} frames${window}: ${texts.join(', ')}  ·  ${run.log}  ·  ${run.map}  ·  d2s1r ${run.version}`;
}

// Keeps what drawing needs of every frame.
function prepareFrames() {
  const frames = run.index.length;
  drawnX = new Float64Array(frames).fill(NaN);
  drawnY = new Float64Array(frames).fill(NaN);
  wrong = new Uint8Array(frames);
  for (let f = 0; f < frames; f++) {
    const pose = poseOf(f), at = pose || truthOf(f);
    if (at) [drawnX[f], drawnY[f]] = [at.x, at.y];
    wrong[f] = isWrong(errorOf(f, pose)) ? 1 : 0;
  }
}

// ---- Filters ---------------------------------------------------------------------------------------------------------

function makeFilters() {
  const filters = $('filters');
  const add = (id, type, attributes, ...label) => {
    const box = element('label', '');
    const input = element('input', '', {id, type, ...attributes});
    box.append(...(type === 'checkbox' ? [input, ...label] : [...label, input]));
    filters.append(box);
    input.addEventListener('input', applyFilters);
  };
  kStatuses.forEach((name, i) => add(`show-${name}`, 'checkbox', {checked: true}, dot(kStatusColors[i]), name));
  add('least-confidence', 'number', {min: 0, max: 1, step: 0.05, value: 0}, 'confidence from ');
  add('greatest-confidence', 'number', {min: 0, max: 1, step: 0.05, value: 1}, 'up to ');
  if (run.truth) add('only-wrong', 'checkbox', {}, `only poses off by ${run.tolerance[0]} m or ${run.tolerance[1]}°`);
  filters.append(element('span', '', {id: 'count'}));
  $('error-head').textContent = run.truth ? 'error' : '';
}

function applyFilters() {
  const statuses = kStatuses.map(name => $(`show-${name}`).checked);
  const least = +$('least-confidence').value, greatest = +$('greatest-confidence').value;
  const onlyWrong = run.truth && $('only-wrong').checked;
  shown = [];
  for (let f = 0; f < run.index.length; f++)
    if (statuses[run.status[f]] && run.confidence[f] >= least && run.confidence[f] <= greatest &&
        (!onlyWrong || wrong[f])) shown.push(f);
  passes = new Uint8Array(run.index.length);
  for (const f of shown) passes[f] = 1;
  $('count').textContent = `${shown.length} of ${run.index.length} frames`;
  redraw();
}

// ---- Acting ----------------------------------------------------------------------------------------------------------

function sized(canvas) {
  const width = canvas.clientWidth, height = canvas.clientHeight, ratio = devicePixelRatio;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const g = canvas.getContext('2d');
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  return {g, width, height};
}

function drawView() {
  const {g, width, height} = sized($('map'));
  Object.assign(canvasSize, {width, height});
  g.clearRect(0, 0, width, height);
  drawMap(g);
  drawPath(g);
  drawSelected(g);
  drawScaleBar(g);
}

let pending = null;  // what is drawn at the next frame of the screen
let scrollsToSelected = false;  // whether the list then moves to the selected frame

function redraw(onlyView = false) {
  if (pending === null) requestAnimationFrame(() => {
    const all = pending;
    pending = null;
    drawView();
    if (!all) return;
    drawTimeline();
    drawDetails();  // the list gets the room that is left
    if (scrollsToSelected) scrollToSelected();
    drawList();
    drawLegend();
  });
  pending = pending || !onlyView;
}

const middleOfMap = () => ({
  x: run.origin[0] + run.width * run.cell_size / 2, y: run.origin[1] + run.height * run.cell_size / 2});

function fit() {
  const box = $('map'), margin = 30;
  view.scale = Math.min((box.clientWidth - margin) / run.width, (box.clientHeight - margin) / run.height) / run.cell_size;
  view.fitted = view.scale;
  Object.assign(view, middleOfMap());
  redraw(true);
}

function isFitted() {
  const {x, y} = middleOfMap();
  return view.scale === view.fitted && view.x === x && view.y === y;
}

function zoom(factor, x = canvasSize.width / 2, y = canvasSize.height / 2) {
  const scale = Math.min(2000, Math.max(view.fitted / 4, view.scale * factor));
  view.x += (x - canvasSize.width / 2) * (1 / view.scale - 1 / scale);
  view.y -= (y - canvasSize.height / 2) * (1 / view.scale - 1 / scale);
  view.scale = scale;
  redraw(true);
}

function centre() {
  const places = selected < 0 ? [] : placesOf(selected), at = places[place] || places[0];
  if (!at) return;
  view.x = at.x;
  view.y = at.y;
  redraw(true);
}

// Moves the map so far that the selected frame is in sight.
function keepInView() {
  const margin = 40, x = pixelX(drawnX[selected]), y = pixelY(drawnY[selected]);
  if (x < margin || y < margin || x > canvasSize.width - margin || y > canvasSize.height - margin) centre();
}

function scrollToSelected() {
  scrollsToSelected = false;
  const row = shown.indexOf(selected), list = $('list'), room = list.clientHeight - kRowHeight;  // below the head
  if (row >= 0 && (row * kRowHeight < list.scrollTop || (row + 1) * kRowHeight > list.scrollTop + room))
    list.scrollTop = Math.max(0, (row + 0.5) * kRowHeight - room / 2);
}

function select(f) {
  selected = f;
  place = 0;
  scrollsToSelected = true;
  location.replace(f < 0 ? '#' : '#frame=' + run.index[f]);  // so that a link leads to the frame
  redraw();
}

// The frame that the address names; -1 if it names none.
function linkedFrame() {
  const named = /^#frame=(\d+)$/.exec(location.hash);
  return named ? run.index.indexOf(+named[1]) : -1;
}

function step(by) {
  if (shown.length === 0) return;
  const at = shown.indexOf(selected);
  select(shown[at < 0 ? 0 : Math.min(shown.length - 1, Math.max(0, at + by))]);
  keepInView();
}

// The place of the selected frame, or the frame, that is drawn nearest to a pixel.
function clickMap(x, y) {
  const distanceTo = pose => Math.hypot(pixelX(pose.x) - x, pixelY(pose.y) - y);
  if (selected >= 0) {
    const places = placesOf(selected), near = places.findIndex((p, i) => i !== place && distanceTo(p) < 9);
    if (near >= 0) {
      place = near;
      redraw();
      return;
    }
  }
  let best = -1, least = 15;
  for (const f of shown) {
    const distance = distanceTo({x: drawnX[f], y: drawnY[f]});
    if (distance < least) [best, least] = [f, distance];
  }
  select(best);
}

function listenToMap() {
  const map = $('map'), pointers = new Map();
  let moved = 0;
  map.addEventListener('pointerdown', e => {
    map.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, {x: e.offsetX, y: e.offsetY});
    if (pointers.size === 1) moved = 0;
  });
  map.addEventListener('pointermove', e => {
    const x = view.x + (e.offsetX - canvasSize.width / 2) / view.scale, y = view.y - (e.offsetY - canvasSize.height / 2) / view.scale;
    $('where').textContent = `${x.toFixed(2)}, ${y.toFixed(2)} m`;
    const last = pointers.get(e.pointerId);
    if (!last) return;
    const other = [...pointers].find(([id]) => id !== e.pointerId);
    if (other) {
      const distance = (p, q) => Math.hypot(p.x - q.x, p.y - q.y), now = {x: e.offsetX, y: e.offsetY};
      zoom(distance(now, other[1]) / Math.max(1, distance(last, other[1])), other[1].x, other[1].y);
      moved += 10;
    } else {
      moved += Math.hypot(e.offsetX - last.x, e.offsetY - last.y);
      view.x -= (e.offsetX - last.x) / view.scale;
      view.y += (e.offsetY - last.y) / view.scale;
      redraw(true);
    }
    pointers.set(e.pointerId, {x: e.offsetX, y: e.offsetY});
  });
  map.addEventListener('pointerup', e => {
    if (pointers.size === 1 && moved < 4) clickMap(e.offsetX, e.offsetY);
    pointers.delete(e.pointerId);
  });
  map.addEventListener('pointercancel', e => pointers.delete(e.pointerId));
  map.addEventListener('wheel', e => {
    e.preventDefault();
    zoom(Math.exp(-e.deltaY * (e.deltaMode ? 0.05 : 0.0015)), e.offsetX, e.offsetY);
  }, {passive: false});
}

// A click selects the nearest frame that passes the filters; so does dragging.
function clickTimeline(x) {
  const width = $('timeline').clientWidth;
  let best = -1;
  for (const f of shown) if (best < 0 || Math.abs(frameX(f, width) - x) < Math.abs(frameX(best, width) - x)) best = f;
  if (best >= 0) select(best);
}

function listen() {
  listenToMap();
  const timeline = $('timeline');
  timeline.addEventListener('pointerdown', e => { timeline.setPointerCapture(e.pointerId); clickTimeline(e.offsetX); });
  timeline.addEventListener('pointermove', e => { if (e.buttons) clickTimeline(e.offsetX); });
  $('rows').addEventListener('click', e => {
    const row = e.target.closest('.row');
    if (row) select(+row.dataset.frame);
  });
  $('details').addEventListener('click', e => {
    const row = e.target.closest('tr.place');
    if (!row) return;
    place = +row.dataset.place;
    redraw();
  });
  $('list').addEventListener('scroll', drawList);
  $('fit').addEventListener('click', fit);
  $('nearer').addEventListener('click', () => zoom(1.5));
  $('farther').addEventListener('click', () => zoom(1 / 1.5));
  $('follow').addEventListener('click', centre);
  $('laser').hidden = !$('calibration').querySelector('svg');
  $('laser').addEventListener('click', () => $('calibration').showModal());
  window.addEventListener('resize', () => {
    if (isFitted()) fit();
    redraw();
  });
  window.addEventListener('keydown', e => {
    if (e.target.tagName === 'INPUT' || e.ctrlKey || e.metaKey || e.altKey) return;
    const actions = {
      ArrowRight: () => step(1), ArrowDown: () => step(1), ArrowLeft: () => step(-1), ArrowUp: () => step(-1),
      PageDown: () => step(20), PageUp: () => step(-20), Home: () => step(-Infinity), End: () => step(Infinity),
      f: fit, c: centre, '+': () => zoom(1.5), '-': () => zoom(1 / 1.5), Escape: () => select(-1)};
    if (!actions[e.key]) return;
    e.preventDefault();
    actions[e.key]();
  });
}

async function start() {
  const [results, map, packed] = await Promise.all(['data-results', 'data-map', 'data-scans'].map(unpack));
  run = JSON.parse(new TextDecoder().decode(results));
  cells = new Uint8Array(map);
  scans = findScans(packed);
  prepareFrames();
  drawSummary();
  makeLevels();
  makeFilters();
  listen();
  Object.assign(canvasSize, {width: $('map').clientWidth, height: $('map').clientHeight});
  fit();
  applyFilters();
  const linked = linkedFrame();
  if (linked >= 0 || shown.length > 0) select(linked >= 0 ? linked : shown[0]);
  addEventListener('hashchange', () => linkedFrame() >= 0 && linkedFrame() !== selected && select(linkedFrame()));
  requestAnimationFrame(() => requestAnimationFrame(() => document.body.dataset.ready = 'yes'));
}

start().catch(error => {
  $('summary').textContent = `The report cannot be shown: ${error.message}. A browser of 2023 or later is needed.`;
  throw error;
});
